from ev import load, QS
import numpy as np, json, os, sys
from scipy.linalg import cho_factor, cho_solve, solve_triangular, cholesky
from numpy.linalg import slogdet, solve, inv
class Case2:
    def __init__(s,path):
        s.h=h=load(path); s.T=len(h['trials'])
        s.q_of=[QS.index(c['quantity']) for c in h['channels']]
        s.c=[c for c in h['candidates'] if not (c['failed'] and c['kind']!='nominal')]
        # keep best per effect set by loss
        best={}
        for c in s.c:
            n='+'.join(sorted(c['effects'])) or 'none'
            if n not in best or c['loss']<best[n]['loss']: best[n]=c
        s.by=best; s.nom=[c for c in s.c if c['kind']=='nominal'][0]
        s.rmin=[np.maximum(1,np.array([np.abs(c['raw'][t]) for c in s.c]).min(0)/3) for t in range(s.T)]
        s.idx=[[np.where(tr['channel']==ch)[0] for ch in range(len(h['channels']))] for tr in h['trials']]
    def white(s,c,a,kappa,b,tau,taus=None):
        """per trial: r,S,J whitened and logdet"""
        out=[]
        for t,tr in enumerate(s.h['trials']):
            S=c['s'][t] if c['s'] else tr['s']; J=c['jacobian'][t]
            M=np.column_stack([c['raw'][t],S,J]) if J.size else np.column_stack([c['raw'][t],S])
            M=M/tr['weight'][:,None]
            sh=(c['raw'][t]-s.nom['raw'][t])/tr['weight']
            X=np.zeros_like(M); ld=0
            for ch,idx in enumerate(s.idx[t]):
                if len(idx)==0: continue
                sig=1/tr['weight'][idx]; m=tr['model'][idx]
                n2=np.maximum(sig**2-m**2,(0.3*sig)**2)*s.rmin[t][idx]**2*b**2
                p=np.sqrt(a*a*m*m+kappa**2*sh[idx]**2)
                tt=tr['t'][idx]
                K=np.exp(-np.abs(tt[:,None]-tt[None,:])/tau)*np.outer(p,p)
                K[np.diag_indices(len(idx))]+=n2
                L=cholesky(K,lower=True)
                X[idx]=solve_triangular(L,M[idx],lower=True); ld+=2*np.log(np.diag(L)).sum()
            m=S.shape[1]; out.append((X[:,0],X[:,1:1+m],X[:,1+m:],ld))
        return out
    def score(s,c,a=1,kappa=0.2,b=1,tau=0.4,per=False):
        W=s.white(c,a,kappa,b,tau)
        k=len(c['coordinates'])
        sc=np.array([x['scale'] for x in c['coordinates']]) if k else np.zeros(0)
        dv=np.array([x['value']-x['off'] for x in c['coordinates']]) if k else np.zeros(0)
        L0=np.diag(1/sc**2) if k else np.zeros((0,0))
        N=[];g=[];q=[];ld=[]
        for (r,S,J,l) in W:
            A=np.eye(S.shape[1])+S.T@S; Ai=inv(A); Sr=S.T@r
            q.append(r@r-Sr@Ai@Sr); ld.append(l+slogdet(A)[1])
            if k:
                SJ=S.T@J; N.append(J.T@J-SJ.T@Ai@SJ); g.append(J.T@r-SJ.T@Ai@Sr)
        P=[]
        for t in range(s.T):
            if k:
                P1=L0+sum((N[u] for u in range(s.T) if u!=t),np.zeros((k,k)))
                gg=sum((g[u] for u in range(s.T) if u!=t),np.zeros(k))+L0@dv
                dl=-solve(P1,gg)
                lo=np.array([x['low']-x['value'] for x in c['coordinates']]); hi=np.array([x['high']-x['value'] for x in c['coordinates']])
                dl=np.clip(dl,np.minimum(lo,0),np.maximum(hi,0))
                q1=q[t]+2*g[t]@dl+dl@N[t]@dl; bb=g[t]+N[t]@dl
                Q=q1-bb@solve(P1+N[t],bb)
                l=-0.5*(Q+ld[t]+slogdet(P1+N[t])[1]-slogdet(P1)[1])
            else: l=-0.5*(q[t]+ld[t])
            P.append(l)
        return P if per else sum(P)
