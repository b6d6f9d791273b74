from ev3 import *
class Case4(Case3):
    """adds a misfit that repeats in every trial: basis over insertion (and direction), times what the effects change"""
    def __init__(s,path,tau=1.2,K=6,nominal_too=True):
        super().__init__(path,tau); s.K=K; s.nom_too=nominal_too
        arcs=np.concatenate([tr['arc'] for tr in s.h['trials']]); s.lo,s.hi=arcs.min(),arcs.max()
    def basis(s,tr):
        x=(tr['arc']-s.lo)/max(s.hi-s.lo,1e-9)*(s.K-1)
        B=np.maximum(0,1-np.abs(x[:,None]-np.arange(s.K)[None,:]))
        d=np.zeros(len(x)); cur=1
        # direction by speed
        fwd=(tr['speed']>=-1e-3).astype(float)
        return np.column_stack([B*fwd[:,None],B*(1-fwd)[:,None]])
    def score(s,c,a=1,kappa=0.2,b=1,tau=1.2,kc=None,per=False):
        kc=kappa if kc is None else kc
        nch=len(s.h['channels']); nb=2*s.K
        W=[]
        for t,tr in enumerate(s.h['trials']):
            S=c['s'][t] if c['s'] else tr['s']; J=c['jacobian'][t]
            w=tr['weight'][:,None]
            B=s.basis(tr)
            sh=(c['raw'][t]-s.nom['raw'][t])/tr['weight']
            base=np.column_stack([c['raw'][t],S,J])/w if J.size else np.column_stack([c['raw'][t],S])/w
            X=np.zeros((base.shape[0],base.shape[1]+nch*nb)); ld=0
            for ch,idx in enumerate(s.idx[t]):
                if len(idx)==0: continue
                m=tr['model'][idx]; n=s.n[t][ch]
                open2=m*m+(0.3*n)**2
                p=np.sqrt(a*a*open2+kappa**2*sh[idx]**2); tt=tr['t'][idx]
                n2=np.full(len(idx),n**2)*s.rmin2[t][idx]
                Kv=np.exp(-np.abs(tt[:,None]-tt[None,:])/tau)*np.outer(p,p); Kv[np.diag_indices(len(idx))]+=n2
                L=cholesky(Kv,lower=True)
                q=np.sqrt(kc**2*sh[idx]**2+ (a*a*open2 if s.nom_too else 0))
                M=np.column_stack([base[idx],B[idx]*q[:,None]])
                Y=solve_triangular(L,M,lower=True)
                X[idx,:base.shape[1]]=Y[:,:base.shape[1]]
                X[idx,base.shape[1]+ch*nb:base.shape[1]+(ch+1)*nb]=Y[:,base.shape[1]:]
                ld+=2*np.log(np.diag(L)).sum()
            ms=S.shape[1]; W.append((X[:,0],X[:,1:1+ms],X[:,1+ms:],ld))
        k0=len(c['coordinates']); k=k0+nch*nb
        sc=np.concatenate([[x['scale'] for x in c['coordinates']],np.ones(nch*nb)])
        dv=np.concatenate([[x['value']-x['off'] for x in c['coordinates']],np.zeros(nch*nb)])
        L0=np.diag(1/sc**2)
        N=[];g=[];q=[];ld=[]
        for (r,S,J,l) in W:
            A=np.eye(S.shape[1])+S.T@S; Ai=inv(A); Sr=S.T@r
            q.append(r@r-Sr@Ai@Sr); ld.append(l+slogdet(A)[1])
            SJ=S.T@J; N.append(J.T@J-SJ.T@Ai@SJ); g.append(J.T@r-SJ.T@Ai@Sr)
        Na=sum(N)+L0; ga=sum(g)+L0@dv; P=[]
        for t in range(s.T):
            P1=Na-N[t]; gg=ga-g[t]
            dl=-solve(P1,gg)
            q1=q[t]+2*g[t]@dl+dl@N[t]@dl; bb=g[t]+N[t]@dl
            Q=q1-bb@solve(P1+N[t],bb)
            P.append(-0.5*(Q+ld[t]+slogdet(P1+N[t])[1]-slogdet(P1)[1]))
        return P if per else sum(P)
