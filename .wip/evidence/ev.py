import numpy as np, json, struct, glob, os, sys
from numpy.linalg import slogdet, solve, cholesky, inv
def load(path):
    b=open(path,'rb').read()
    n=struct.unpack('<Q',b[:8])[0]
    h=json.loads(b[8:8+n]); d=np.frombuffer(b[8+n:],dtype='<f4')
    def arr(a):
        s=a['shape']; k=int(np.prod(s)); v=d[a['at']//4:a['at']//4+k].astype(float)
        return v if len(s)==1 else v.reshape(s).T
    for t in h['trials']:
        for k in list(t):
            if isinstance(t[k],dict): t[k]=arr(t[k])
        t['channel']=t['channel'].astype(int)
    for c in h['candidates']:
        c['raw']=[arr(a) for a in c['raw']]; c['jacobian']=[arr(a) for a in c['jacobian']]; c['s']=[arr(a) for a in c['s']]
    return h
QS=['Force','DriveForce','Tip','Shape']
class Case:
    def __init__(s,path,tau=0.3,own_s=True,floor_min=0.0):
        s.h=h=load(path); s.tau=tau
        s.q_of=[QS.index(c['quantity']) for c in h['channels']]
        cands=h['candidates']
        # dedupe
        s.c=[c for c in cands if not (c['failed'] and c['kind']!='nominal')]
        s.blocks=[] # (trial, idx, U/sqrtn, lam, q)
        s.T=len(h['trials'])
        for t,tr in enumerate(h['trials']):
            rabs=np.array([np.abs(c['raw'][t]) for c in s.c]); rmin=rabs.min(0)
            infl=np.maximum(1.0,rmin/3.0)
            for ch in range(len(h['channels'])):
                idx=np.where(tr['channel']==ch)[0]
                if len(idx)==0: continue
                w=tr['weight'][idx]; sig=1/w; m=tr['model'][idx]
                n2=np.maximum(sig**2-m**2,(0.3*sig)**2)*infl[idx]**2
                tt=tr['t'][idx]
                K=np.exp(-np.abs(tt[:,None]-tt[None,:])/tau)*np.outer(m,m)/np.sqrt(np.outer(n2,n2))
                lam,U=np.linalg.eigh(K); lam=np.maximum(lam,0)
                # transform acts on r (whitened by w): r/w/sqrt(n2)
                A=U.T*(sig/np.sqrt(n2))[None,:]
                s.blocks.append((t,idx,A,lam,s.q_of[ch],np.log(n2).sum()))
        s.tr=[]
        for c in s.c:
            per=[]
            for t in range(s.T):
                parts=[(A,lam,q,idx) for (tt,idx,A,lam,q,_) in s.blocks if tt==t]
                J=c['jacobian'][t]; S=c['s'][t] if c['s'] else h['trials'][t]['s']
                M=np.column_stack([c['raw'][t],S,J]) if J.size else np.column_stack([c['raw'][t],S])
                X=np.vstack([A@M[idx] for A,lam,q,idx in parts])
                lam=np.concatenate([p[1] for p in parts]); qq=np.concatenate([np.full(len(p[1]),p[2]) for p in parts])
                m=S.shape[1]
                per.append((X[:,0],X[:,1:1+m],X[:,1+m:],lam,qq))
            s.tr.append(per)
    def score(s,ci,a,detail=False):
        c=s.c[ci]; a2=np.array(a)**2
        k=len(c['coordinates'])
        sc=np.array([x['scale'] for x in c['coordinates']]) if k else np.zeros(0)
        dv=np.array([x['value']-x['off'] for x in c['coordinates']]) if k else np.zeros(0)
        L0=np.diag(1/sc**2) if k else np.zeros((0,0))
        N=[];g=[];q=[];ld=[]
        for (r,S,J,lam,qq) in s.tr[ci]:
            v=1+a2[qq]*lam; d=1/v
            Sd=S*d[:,None]; A=np.eye(S.shape[1])+S.T@Sd
            Ai=inv(A)
            Sr=Sd.T@r
            q.append((r*d*r).sum()-Sr@Ai@Sr)
            ld.append(np.log(v).sum()+slogdet(A)[1])
            if k:
                SJ=Sd.T@J; Jd=J*d[:,None]
                N.append(J.T@Jd-SJ.T@Ai@SJ); g.append(Jd.T@r-SJ.T@Ai@Sr)
        tot=0; per=[]
        for t in range(s.T):
            if k:
                P1=L0+sum((N[u] for u in range(s.T) if u!=t),np.zeros((k,k)))
                gg=sum((g[u] for u in range(s.T) if u!=t),np.zeros(k))+L0@dv
                dl=-solve(P1,gg)
                # stay within a local region
                q1=q[t]+2*g[t]@dl+dl@N[t]@dl
                b=g[t]+N[t]@dl
                Q=q1-b@solve(P1+N[t],b)
                l=-0.5*(Q+ld[t]+slogdet(P1+N[t])[1]-slogdet(P1)[1])
            else: l=-0.5*(q[t]+ld[t])
            per.append(l); tot+=l
        return (tot,per) if detail else tot
    def best(s,ci,la0=0.0,s0=0.7,grid=np.exp(np.linspace(np.log(0.05),np.log(30),14)),init=None):
        present=sorted(set(s.q_of))
        a=np.ones(4) if init is None else np.array(init,float)
        def pen(a): return sum(-0.5*((np.log(a[q])-la0)/s0)**2 for q in present)
        cur=s.score(ci,a)+pen(a)
        for it in range(2):
            for q in present:
                vals=[]
                for x in grid:
                    b=a.copy(); b[q]=x; vals.append(s.score(ci,b)+pen(b))
                j=int(np.argmax(vals)); 
                if vals[j]>cur: cur=vals[j]; a[q]=grid[j]
        return cur,a
def names(c): return '+'.join(c['effects']) or 'none'
